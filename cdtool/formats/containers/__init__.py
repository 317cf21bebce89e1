"""Container formats: HDF5, MDF, TDMS, Parquet, ULog, XLSX."""
