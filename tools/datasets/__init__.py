"""Readers of public data sets and of CSV files, a module for each format."""
