"""phongbench beside other tools, and checks of its own timing."""
