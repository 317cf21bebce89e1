"""Container formats: HDF5, TDMS, Parquet, XLSX."""
