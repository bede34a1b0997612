/* Costs of all pairs of plans in lanes: behind lanes.h, ROWS, PLANS and pair(); see ranking.py. */
/* way (ROWS), first, second (ROWS, PLANS), query (4), costs (PLANS of the second, PLANS) */
void rank(const double *way, const double *first, const double *second, const double *query,
          double *costs) {
  v begun[ROWS], other[ROWS], asked[4], cost[1];
  for (int i = 0; i < 4; i++) asked[i] = all(query[i]);
  for (int j = 0; j < PLANS; j += LANES) {
    for (int l = 0; l < LANES; l++) {
      const int plan = j + l < PLANS ? j + l : PLANS - 1;
      for (int r = 0; r < ROWS; r++) other[r][l] = second[plan * ROWS + r];
    }
    for (int i = 0; i < PLANS; i++) {
      for (int r = 0; r < ROWS; r++) begun[r] = all(way[r] + first[i * ROWS + r]);
      pair(begun, other, asked, cost);
      for (int l = 0; l < LANES && j + l < PLANS; l++) costs[i * PLANS + j + l] = cost[0][l];
    }
  }
}
