"""The HTTP service over phongbench: shading on request, stored runs and finished reports. It never measures."""
