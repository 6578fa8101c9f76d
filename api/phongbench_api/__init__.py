"""The HTTP service over phongbench: shading on request, stored runs and finished reports. Nothing is served yet."""
