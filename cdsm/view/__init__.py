"""Live view of an arm in the browser, with sliders. The page shows mm, degrees and N/mm.

:func:`show` computes the results for a :class:`Setting` of the sliders, without a browser.
:func:`serve` starts a server whose page shows these results and follows the sliders.
"""

from cdsm.view.live_view import View
from cdsm.view.server import serve
from cdsm.view.state import Condition, Setting, Shown, show

__all__ = ["Condition", "Setting", "Shown", "View", "serve", "show"]
