"""Layer format that counts its writers' calls."""

from collections import Counter

from posefield.encode.usd import crate_template
from posefield.encode.usd.layer_content import LayerBuilder, LayerContent, LayerPattern
from posefield.encode.usd.template_cache import Template, TemplateFormat


class Counted:
    """Layers of a form; calls: how many were written by usd-core, and how many templates made."""

    def __init__(self, form: TemplateFormat = crate_template) -> None:
        self.form = form
        self.calls = Counter[str]()

    def pattern(self, author: LayerBuilder, content: LayerContent) -> LayerPattern:
        return self.form.pattern(author, content)

    def ordinary(self, author: LayerBuilder, content: LayerContent) -> bytes:
        self.calls["ordinary"] += 1
        return self.form.ordinary(author, content)

    def template(
        self, author: LayerBuilder, content: LayerContent, pattern: LayerPattern
    ) -> Template | None:
        self.calls["template"] += 1
        return self.form.template(author, content, pattern)
