"""Solid surfaces as flat panels of sources: their flow, their strengths, and how they are made."""
