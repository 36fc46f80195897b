"""The floor that the service and the training job share: numpy only."""
