"""The HTML around the page: its own style, nothing from elsewhere.

The scripts come last, so that a browser paints the first line before it has read them.
"""

from studies.page.look import STYLE

TEMPLATE = (
    "{% block js_resources %}{% endblock %}"
    "{% block postamble %}<style>" + STYLE + "</style>{% endblock %}"
    "{% block contents %}{{ super() }}"
    '<h1 id="loading" role="status">workbench: the page is loading</h1>'
    "{{ bokeh_js }}{% endblock %}"
)
