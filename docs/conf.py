"""Sphinx configuration: MyST pages, the reference taken from the docstrings, warnings are errors."""

from importlib import metadata

from nonsmooth.results.statuses import STATUSES

project = "nonsmooth"
author = "the nonsmooth authors"
copyright = "2026, the nonsmooth authors"
release = metadata.version("nonsmooth")
version = release

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "sphinx.ext.viewcode"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "guides/measured_methods.md"]  # the latter is included by a guide
templates_path: list[str] = []

myst_enable_extensions = ["amsmath", "dollarmath", "deflist", "colon_fence", "substitution"]
myst_heading_anchors = 3
# The table of statuses is written from the one place that defines them.
_rows = [f"| `{status.name}` | {status.happened} | {status.remedy} |" for status in STATUSES]
myst_substitutions = {"statuses": "\n".join(["| name | what happened | what to do |", "|---|---|---|", *_rows])}

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = "nonsmooth"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["pages.css"]
