model CascadedTanksLinear "two first-order lags in series about an operating point"
  // Units are those of the record.
  parameter Real K = 2 "rise of the level for one unit of the command";
  parameter Real tau1(min=0) = 60 "time constant of the upper tank";
  parameter Real tau2(min=0) = 90 "time constant of the lower tank";
  parameter Real offset = 1.5 "level at a command of zero";
  input Real u "command";
  Real level_upper(start=10);
  output Real level_lower(start=10);
  Real outflow = level_lower - offset;
equation
  tau1*der(level_upper) = K*u - level_upper;
  tau2*der(level_lower) = level_upper - outflow;
end CascadedTanksLinear;
