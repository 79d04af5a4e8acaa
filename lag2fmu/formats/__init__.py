"""Readers and writers of mechanisms by suffix: text (.toml) with its schema for editors, and Python files."""
