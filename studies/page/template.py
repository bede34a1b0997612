"""The HTML around the page: its own style, nothing from elsewhere."""

from studies.page.look import STYLE

TEMPLATE = "{% block postamble %}<style>" + STYLE + "</style>{% endblock %}"
