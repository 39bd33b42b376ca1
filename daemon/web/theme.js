// Before anything is drawn, so that nobody is dazzled by the theme that they have not chosen.
try {
  const theme = localStorage.getItem('relief.theme');
  if (theme === 'light' || theme === 'dark') document.documentElement.dataset.theme = theme;
} catch {
  // A browser that keeps nothing shows what the system has.
}
