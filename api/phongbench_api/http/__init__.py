"""What holds for every route: middleware, problems, media types, OpenAPI."""
