"""Uncertainty of numbers: tolerances of an arm, uncertainty budgets, Monte Carlo.

The budgets follow the *Guide to the expression of uncertainty in measurement* (JCGM 100:2008), the
Monte Carlo runs its Supplement 1 (JCGM 101:2008).
"""
