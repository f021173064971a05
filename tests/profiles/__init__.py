"""The shipped profiles against facts taken by hand from the documents, apart from the YAML."""
