"""From point series to numbers: standardised points, kernel mean embeddings, summaries."""
