"""The studies of the antenna and the command `antenna-ocp` that runs them."""

from antenna_ocp import hiding_sentence as _hiding_sentence

# a script that imports a study is told here what the command is told when it starts
if _sentence := _hiding_sentence():
    raise ImportError(_sentence)
