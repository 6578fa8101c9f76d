"""What `import phongbench` offers: highlights of arrays, curves, shading, pictures, studies and their answers."""
