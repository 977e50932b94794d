"""Drawing of the views that ``kinds`` lists."""
