"""Container formats: HDF5, MDF, TDMS, Parquet, XLSX."""
