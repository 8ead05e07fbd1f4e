"""The live view: an arm in the browser, with sliders. The page shows mm, degrees and N/mm.

:func:`show` computes what a page shows at a :class:`Setting` of the sliders, without a browser;
:func:`serve` puts it on a page and keeps it up to date.
"""

from cdsm.view.server import View, serve
from cdsm.view.state import Condition, Setting, Shown, show

__all__ = ["Condition", "Setting", "Shown", "View", "serve", "show"]
