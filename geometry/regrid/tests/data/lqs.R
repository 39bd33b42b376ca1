# Makes lqs-windows.csv and lqs-planes.csv: 200 windows of samples, and the plane with the
# least median of squared residuals over all triples, as MASS finds it. Run in this folder:
#   Rscript lqs.R
library(MASS)
set.seed(1995)
windows <- list()
planes <- list()
for (k in 1:200) {
  n <- 9 + k %% 16
  x <- round(runif(n, -1.6, 1.6), 3)
  y <- round(runif(n, -1.6, 1.6), 3)
  z <- runif(1, -1, 1) * x + runif(1, -1, 1) * y + rnorm(n, 0, 0.05)
  if (k %% 3 == 0) z <- z + 5 * (x + 0.3 * y > runif(1, -1, 1))   # a step
  if (k %% 2 == 0) {                                              # outliers
    out <- runif(n) < 0.3
    z[out] <- z[out] + runif(sum(out), -30, 30)
  }
  z <- round(z, 6)
  fit <- lqs(cbind(x, y), z, method = "lms", nsamp = "exact")
  windows[[k]] <- data.frame(window = k, dx = x, dy = y, z = z)
  planes[[k]] <- data.frame(window = k, a = fit$coefficients[2], b = fit$coefficients[3],
                            c = fit$coefficients[1], criterion = fit$crit)
}
options(digits = 15)
write.csv(do.call(rbind, windows), "lqs-windows.csv", row.names = FALSE, quote = FALSE)
write.csv(do.call(rbind, planes), "lqs-planes.csv", row.names = FALSE, quote = FALSE)
