"""Work behind a request: admission, warm kernels, evaluation."""
