"""Tables, figures and files of a motion of the arm."""
