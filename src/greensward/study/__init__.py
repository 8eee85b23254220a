"""Studies: what people say of pictures of grass, asked, kept and summarised."""
