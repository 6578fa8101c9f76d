"""Files, documents, processes and progress; knows nothing of light."""
