"""FrankaKitchen of gymnasium-robotics as a world: its MuJoCo assets, moved by skills of our own."""
