"""The page: the templates of `templates/report/` filled with the sections, as one text that needs no other file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jinja2
from markupsafe import Markup

from fieldsid.errors import ArtifactError
from fieldsid.page import dense
from fieldsid.templates import template_path

PAGE, STYLE, SCRIPT = "report.html", "report.css", "report.js"


def html_of(context: Mapping[str, Any]) -> str:
    """Return the HTML text of a context by `sections.context_of`; raises ArtifactError where a template has a mistake."""
    folder = template_path("report")
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["dense"] = dense
    environment.filters["drawn"] = Markup  # the charts are this program's own SVG, every word in them escaped
    try:
        style, script = ((folder / n).read_text(encoding="utf-8") for n in (STYLE, SCRIPT))
        own = {"style": Markup(style), "script": Markup(script)}  # noqa: S704 - the templates' own files
        text: str = environment.get_template(PAGE).render(**context, **own)
    except jinja2.TemplateError as error:
        raise ArtifactError(
            f"the template `{folder / PAGE}` has a mistake", found=str(error), hint="install fieldsid again"
        ) from error
    return text
