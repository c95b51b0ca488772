"""The embedded household: geometry in MuJoCo, truth and skills in plain Python, its renderers."""
