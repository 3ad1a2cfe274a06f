"""How Sphinx builds the site: `make docs`. Nothing is fetched, neither here nor by the pages."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]

project = "antenna-ocp"
author = "The antenna-ocp authors"
copyright = author

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "extensions.docstrings",
    "extensions.gallery",
    "extensions.mathml",
    "extensions.offline",
    "extensions.reports",
    "extensions.tables",
]
exclude_patterns = ["examples", "generated/tables", "generated/reports/results", "build"]
nitpicky = True
# what other packages define has no page here, and their lists of names would have to be fetched
nitpick_ignore_regex = [
    ("py:.*", r"(?!ocp\.).*"),
    ("py:.*", r"ocp\.[a-z].*"),
]

myst_enable_extensions = ["attrs_block", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

default_role = "name"
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
add_module_names = False
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
# "name : meaning [unit]" is this project's form; as directives they would clash with the fields
napoleon_custom_sections = [("Attributes", "params_style")]

html_theme = "furo"
html_title = "antenna-ocp"
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
pygments_style = "friendly"
