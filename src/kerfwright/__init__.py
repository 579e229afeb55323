"""From photographs of a piece of carpentry to the plans to build it again."""

__version__ = "0.1.0"
