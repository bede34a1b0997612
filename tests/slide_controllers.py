"""The controllers that position a slide: what their tests run over."""

from controllers import CONTROLLERS
from linearize.standard import slide_modes

SLIDE_CONTROLLERS = {name: m for name, m in CONTROLLERS.items() if m.modes is slide_modes}
