"""Three objectives of the truss: a surface, found slice by slice, each a front of two of them."""
