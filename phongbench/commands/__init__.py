"""Commands of the command line, by what they are for; cli.py holds the group and those that handle runs."""
