"""How Sphinx sets the site: Markdown and reStructuredText in, pages that need no script and no network out."""

import re

import pypandoc
from docutils import nodes
from sphinx.errors import ExtensionError

project = author = "asympk"
language = "en_GB"
html_language = "en-GB"
extensions = ["myst_parser", "sphinx_gallery.gen_gallery", "sphinx.ext.autodoc"]
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "asympk"
smartquotes = False  # a prime is a rate, and no apostrophe
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = html_show_sourcelink = html_show_copyright = False
html_show_sphinx = False
html_domain_indices = html_use_index = False
numfig = True
numfig_format = {"figure": "Figure %s", "table": "Table %s", "section": "section %s"}
math_eqref_format = "({number})"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
pygments_style = "a11y-light"  # of Furo's own accessible-pygments: contrast above 4.5
highlight_language = "none"
exclude_patterns = ["arrow-parts.md", "gallery-source/**", "**/sg_execution_times.rst", "sg_execution_times.rst"]
sphinx_gallery_conf = {
    "examples_dirs": "gallery-source",
    "gallery_dirs": "derivations",
    "plot_gallery": "False",  # the results are those that are stored, which a test compares with the scripts
    "download_all_examples": False,
    "show_signature": False,
    "notebook_extensions": set(),
    "write_computation_times": False,
    "within_subsection_order": "FileNameSortKey",
}
suppress_warnings = ["config.cache"]
html_math_renderer = "mathml"
_ROW = re.compile(r"\\(?:label\{.*?\}|notag|nonumber)")
_ENVIRONMENT = re.compile(r"\\begin\{(equation|align)(\*?)\}(.*)\\end\{\1\2\}", re.DOTALL)
_FUNCTION = re.compile(r'<mi mathvariant="normal">([a-z]{2,6})</mi><mo>&#8289;</mo>')
_PRIME = re.compile(r"<msup>(<mi>[^<]*</mi>)(<mo>′+</mo>)</msup>")  # a prime is high by itself
_LOW = re.compile(r"\\left([(\[])((?:(?!\\left|\\right|\\frac|\\begin|\\sqrt|\^).)*)\\right([)\]])")
_ACCENTS = str.maketrans("\u0307\u0308", "\u02d9\u00a8")  # those that stand alone lie in the middle of their letters
_MARKS = re.compile(r"(``.*?``|`[^`]*`)|([|*\\]|(?<=\w)_(?!\w))")


def setup(app):
    """Give Sphinx what it has no option for: formulas as MathML, and docstrings in plain words."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("doctree-resolved", _formulas)
    app.connect("autodoc-process-docstring", _plain)
    app.connect("source-read", _without_archives_and_images)
    return {"parallel_read_safe": True}


def _without_archives_and_images(app, docname, source):
    """Leave out of sphinx-gallery's pages archives, whose bytes depend on the time, and images, which show nothing."""
    text = re.sub(r"\n +\.\. container:: sphx-glr-download sphx-glr-download-zip\n\n.*\n", "\n", source[0])
    source[0] = re.sub(r"\n +\.\. image:: .*_thumb\.png\n +:alt:\n", "\n", text)


def _formulas(app, doctree, docname):
    """Put the MathML of a page's formulas beside their LaTeX; Pandoc is asked for all of them at once."""
    found = [*doctree.findall(nodes.math), *doctree.findall(nodes.math_block)]
    if not found:
        return
    marks = ["$$" if isinstance(node, nodes.math_block) else "$" for node in found]
    asked = [f"{mark}{_bare(node.astext())}{mark}" for node, mark in zip(found, marks, strict=True)]
    answer = pypandoc.convert_text("\n\n".join(asked), "html", "markdown", extra_args=["--mathml", "--wrap=none"])
    answers = re.findall(r"<p>(.*?)</p>", answer, re.DOTALL)
    for node, latex, mathml in zip(found, asked, answers, strict=True):
        if not mathml.startswith("<math"):
            raise ExtensionError(f"{docname}: Pandoc has no MathML for {latex}")
        mathml = re.sub(r"<annotation.*?</annotation>|</?semantics>", "", mathml).translate(_ACCENTS)
        mathml = _PRIME.sub(r"<mrow>\1\2</mrow>", mathml)
        node["mathml"] = _FUNCTION.sub(r'<mo lspace="0.17em" rspace="0.08em">\1</mo>', mathml)


def _bare(latex):
    latex = _ENVIRONMENT.sub(
        lambda found: rf"\begin{{aligned}}{found[3]}\end{{aligned}}" if found[1] == "align" else found[3], latex
    )
    latex, low = " ".join(_ROW.sub("", latex).split()), ""
    while latex != low:  # brackets that might stretch have more space around them
        low, latex = latex, _LOW.sub(r"\1\2\3", latex)
    return latex


def _inline(writer, node):
    writer.body.append(node["mathml"])
    raise nodes.SkipNode


def _block(writer, node):
    number = f'<span class="eqno">({node["number"]})</span>' if node["number"] else ""
    writer.body.append(f"{writer.starttag(node, 'div', CLASS='math', IDS=node['ids'])}{node['mathml']}{number}</div>\n")
    raise nodes.SkipNode


def _plain(app, what, name, obj, options, lines):
    """Set the indented equations of a docstring as they stand, and let its marks of arithmetic be no markup."""
    lines[:] = "\n\n".join(map(_paragraph, "\n".join(lines).split("\n\n"))).split("\n")


def _paragraph(text):
    if text.startswith(">>>"):
        return text
    return f"::\n\n{text}" if text.startswith("    ") else _MARKS.sub(lambda f: f[1] or f"\\{f[2]}", text)
