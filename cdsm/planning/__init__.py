"""Plan tensions for a wanted stiffness, at one posture or along a path.

The chapter also computes derivatives of the stiffness with respect to the tensions, the range of
stiffness that the tensions can reach, and saturation: the tension above which more tension hardly
stiffens the arm.
"""
