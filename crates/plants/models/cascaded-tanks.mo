model CascadedTanks "two tanks, the upper one drains into the lower one, which is measured"
  // Units are those of the record.
  parameter Real pump_gain(min=0) = 3.3 "inflow for one unit of the command";
  parameter Real alpha_upper(min=0) = 5 "outflow coefficient of the upper tank";
  parameter Real alpha_lower(min=0) = 5 "outflow coefficient of the lower tank";
  final parameter Real area_upper(min=0) = 1 "cross-sections; 1 where they are not known";
  final parameter Real area_lower(min=0) = 1;
  constant Real w = 1e-4 "below this level a parabola stands for the root, whose slope has no bound at empty";
  input Real u "command to the pump";
  Real level_upper(start=10);
  output Real level_lower(start=10);
  Real xu = level_upper/w;
  Real xl = level_lower/w;
  Real root_upper = if level_upper >= w then sqrt(level_upper) elseif level_upper > 0 then (1.5 - 0.5*xu)*xu*sqrt(w) else 0;
  Real root_lower = if level_lower >= w then sqrt(level_lower) elseif level_lower > 0 then (1.5 - 0.5*xl)*xl*sqrt(w) else 0;
equation
  area_upper*der(level_upper) = pump_gain*u - alpha_upper*root_upper;
  area_lower*der(level_lower) = alpha_upper*root_upper - alpha_lower*root_lower;
end CascadedTanks;
