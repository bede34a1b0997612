"""The local page: the loop of the command line where people would rather look than read.

``session`` holds what one browser tab knows, as frozen values with plain functions on them; the
``*_tab`` files show it; ``server`` lets in whoever has the token.
"""
