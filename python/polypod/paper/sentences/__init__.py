"""The paper's qualitative sentences: a measure, numbers and a verdict for each that can be judged.

The measures are statistics over answers of `Mechanism`; samples and seeds are named constants.
"""
