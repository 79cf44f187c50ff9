"""What determines the gains of the H-infinity design: channel bounds, decay, pole limit, noise weight."""
