"""Settings of the documentation site: ``make docs`` builds it into ``docs/_build/html``."""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS / "extensions"), str(DOCS.parent / "src"), str(DOCS.parent)]
os.environ.setdefault("MPLBACKEND", "agg")

import stiction as st  # noqa: E402

project = "stiction"
author = "The stiction developers"
copyright = author  # noqa: A001
version = release = st.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "generated_pages",
    "katex",
    "names",
]
exclude_patterns = ["_build", "templates", "extensions", "**/README.rst"]
templates_path = ["templates"]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
default_role = "name"
smartquotes = False  # "--option" stays as it is

autosummary_generate = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"

napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_preprocess_types = False
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "pydata_sphinx_theme"
html_title = "stiction"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_js_files = ["accessible.js"]
html_copy_source = False
html_show_sourcelink = False
html_use_opensearch = ""
html_show_search_summary = False  # a page opened from disk may not read others
html_theme_options = {
    "logo": {"text": "stiction"},
    "navbar_end": ["theme-switcher"],
    "navbar_persistent": ["search-button"],
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}


GALLERY = ("verdict", "models", "cycles", "valve_tests", "remedies", "export", "reading", "fleet", "paper")

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "subsection_order": [f"../examples/{name}" for name in GALLERY],
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "write_computation_times": False,
    "min_reported_time": 1e9,
    "show_memory": False,
    "show_signature": False,
    "download_all_examples": False,
    "plot_gallery": "True",
    "remove_config_comments": True,
    "doc_module": ("stiction",),
    "backreferences_dir": "gallery/backreferences",
    "reset_modules": ("figure_style.set_figure_style",),
    "capture_repr": ("_repr_html_", "__repr__"),
    "matplotlib_animations": False,
    "thumbnail_size": (360, 220),
    "reference_url": {"stiction": None},
}

warnings.filterwarnings("ignore", message=".*FigureCanvasAgg is non-interactive.*")
