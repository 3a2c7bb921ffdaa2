"""Planted faults: does a test notice when a judgement is turned over?"""
