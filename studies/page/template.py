"""The HTML around the page: its own style, nothing from elsewhere, its address told to nobody.

The scripts come last, so that a browser paints the first line before it has read them.
"""

from studies.page.look import STYLE

TEMPLATE = (
    "{% block js_resources %}{% endblock %}"
    '{% block preamble %}<meta name="referrer" content="no-referrer">'
    '<link rel="icon" href="data:,">{% endblock %}'
    "{% block postamble %}<style>" + STYLE + "</style>{% endblock %}"
    "{% block contents %}{{ super() }}"
    '<h1 id="loading" role="status">workbench: the page is loading</h1>'
    "{{ bokeh_js }}{% endblock %}"
)
