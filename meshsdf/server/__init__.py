"""Painting in a browser: the server behind `meshsdf paint`, and a client of it in Python."""
