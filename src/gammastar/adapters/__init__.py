"""Doors to other tools: each module makes gammastar speak the language of one of them."""
