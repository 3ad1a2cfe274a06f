"""The studies of the antenna and the command `antenna-ocp` that runs them."""

import sys as _sys

# A script that imports a study is told here what the command is told when it starts. While Python
# looks for the module of `python -m studies.cli`, an error would be wrapped in words of its own;
# that module looks by itself.
if _sys.argv[:1] != ["-m"]:
    from antenna_ocp import hiding_sentence as _hiding_sentence

    if _sentence := _hiding_sentence():
        raise ImportError(_sentence)
