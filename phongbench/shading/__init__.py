"""The reflection model over points and lights."""
