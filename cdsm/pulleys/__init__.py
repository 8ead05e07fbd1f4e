"""Cables over pulleys and through sheaths: where they touch, how contacts shift, how long they are.

A cable runs along straight spans and over arcs in the grooves of pulleys.
:mod:`~cdsm.pulleys.contacts` finds the points where it touches, and
:mod:`~cdsm.pulleys.contact_shifts` how these move with the joints.
:class:`~cdsm.pulleys.wraps.Wraps` are all pulleys of an arm,
:class:`~cdsm.pulleys.wrapping.Wrapping` says how its cables run at a posture, and
:mod:`~cdsm.pulleys.wrapped_segments` divides such cables at their holes.
"""
