"""Sphinx configuration: MyST pages, the reference taken from the docstrings, warnings are errors.

Built pages need no network: formulas become MathML, and copy buttons and cards are files of the pages' own. Links to
the documentation of NumPy and others need their inventories, so they are made only with ``INTERSPHINX=1 make docs``.
"""

import os
import re
import sys
from importlib import metadata
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.util import logging

from nonsmooth.results.labels import STATUSES

project = "nonsmooth"
author = "the nonsmooth authors"
copyright = "2026, the nonsmooth authors"
release = metadata.version("nonsmooth")
version = release

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.intersphinx",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "theory/measured_methods.md"]  # the latter is included by a page
templates_path: list[str] = []

myst_enable_extensions = ["amsmath", "dollarmath", "deflist", "colon_fence", "substitution"]
myst_heading_anchors = 3
# Tables that are written from the one place that defines what they hold.
sys.path.insert(0, os.path.dirname(__file__))
import doors  # noqa: E402

_statuses = [[f"`{status.name}`", status.happened, status.remedy] for status in STATUSES]
myst_substitutions = {
    "statuses": doors.table(["name", "what happened", "what to do"], _statuses),
    "options": doors.options(),
    "refusals": doors.refusals(),
}

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
napoleon_google_docstring = False
napoleon_use_rtype = True  # so that types of results are links

_ELSEWHERE = {
    "python": "https://docs.python.org/3",
    "numpy": "https://numpy.org/doc/stable",
    "scipy": "https://docs.scipy.org/doc/scipy",
    "xarray": "https://docs.xarray.dev/en/stable",
    "matplotlib": "https://matplotlib.org/stable",
    "pandas": "https://pandas.pydata.org/docs",
}
intersphinx_mapping = {name: (url, None) for name, url in _ELSEWHERE.items()} if os.environ.get("INTERSPHINX") else {}

copybutton_prompt_text = r"\$ "
copybutton_prompt_is_regexp = True
copybutton_selector = "div:not(.highlight-text) > div.highlight > pre"  # printed output is not typed in again

html_theme = "furo"
html_title = "nonsmooth"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"


def _formula(self: Any, node: nodes.Element) -> None:
    """Write a formula as MathML, which browsers draw themselves."""
    block = isinstance(node, nodes.math_block)
    # What tex2mathml does not know.
    text = re.sub(r"frac(\d)(\d)", r"frac{\1}{\2}", node.astext().replace(r"\dots", r"\ldots"))
    try:
        formula = tex2mathml(text, as_block=block)
    except MathError as error:
        logging.getLogger(__name__).warning("this formula cannot be written: %s: %s", text, error, location=node)
        formula = f"<code>{text}</code>"
    # A space before and behind sin and its like, none around a slash.
    space = '<mspace width="0.1667em"></mspace>'
    formula = re.sub(r"<mo>&ApplyFunction;</mo>(?!\s*<m(o|row))", space, formula)
    named = r"(</m(?:i|n|sub|sup)>)\s*((?:<msup>\s*)?<mi>(?:sin|cos|tan|tanh|exp|log|ln|det)</mi>)"
    formula = re.sub(named, rf"\1{space}\2", formula)
    formula = formula.replace('<mo stretchy="false">/</mo>', '<mo lspace="0" rspace="0">/</mo>')
    self.body.append(f'<div class="math">{formula}</div>' if block else formula)
    raise nodes.SkipNode


def _not_a_class(app: Sphinx, doctree: nodes.document) -> None:
    """Leave words such as "state" and "name" in the type of an argument alone: they are no links to attributes."""
    for link in list(doctree.findall(pending_xref)):
        if link.get("refspecific") and link.get("reftarget") in ("name", "state", "states", "start"):
            link.replace_self(link.children)


def setup(app: Sphinx) -> None:
    """Register the way formulas are written."""
    app.add_html_math_renderer("mathml", (_formula, None), (_formula, None))
    app.connect("doctree-read", _not_a_class)
