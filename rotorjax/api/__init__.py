"""The front door: what `import rotorjax as rj` offers, each from the room where it lives."""
