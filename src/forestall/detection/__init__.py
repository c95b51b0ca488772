"""Detectors: does the scene fit what the demonstrations showed before this subtask?"""
