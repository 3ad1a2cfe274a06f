"""The two-link supporting arm: parameters, reduced model, full model by `models.ancf`."""
