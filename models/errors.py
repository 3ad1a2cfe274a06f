"""The one error of the models: it names the thing, its value and the remedy."""


class ModelError(ValueError):
    """A model was given parameters or a motion outside the range where it holds."""


def require(condition: bool, message: str) -> None:
    """Raise ModelError with `message` unless `condition` holds."""
    if not condition:
        raise ModelError(message)
