"""The site, and what generates its pages and pictures."""
