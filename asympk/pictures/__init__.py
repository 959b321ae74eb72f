"""Pictures: rows or computed paths in, a matplotlib ``Figure`` out."""
