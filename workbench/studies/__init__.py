"""What the commands compute: a configuration in, metrics, tables and a report page out."""
