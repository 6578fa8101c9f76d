"""The generated parts of README.md and of the pages of the guide, reports/docs."""
