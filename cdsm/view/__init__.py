"""Live view of an arm in the browser, with sliders. The page shows mm, degrees and N/mm."""

from cdsm.view.live_view import serve

__all__ = ["serve"]
