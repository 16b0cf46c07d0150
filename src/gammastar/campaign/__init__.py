"""Campaigns: many flights of one mission, each with its own values of what varies."""
