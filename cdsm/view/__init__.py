"""The live view: an arm in the browser, with sliders. mm, degrees and N/mm live here too.

:func:`show` computes what there is to see at a :class:`Setting` of the sliders, and knows no
browser; :func:`serve` puts it on a page and keeps it up to date.
"""

from cdsm.view.server import View, serve
from cdsm.view.state import Condition, Setting, Shown, show

__all__ = ["Condition", "Setting", "Shown", "View", "serve", "show"]
