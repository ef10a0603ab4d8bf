"""The one error for what a person can put right: a wrong recipe, data set, weights file or argument."""


class TrainingError(Exception):
    """Names the file or field that is wrong and what was expected of it."""
