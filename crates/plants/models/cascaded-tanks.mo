model CascadedTanks "two tanks, the upper one drains into the lower one"
  // Units are those of the record.
  parameter Real pump_gain(min=0) = 3.3 "inflow for one unit of the command";
  parameter Real alpha_upper(min=0) = 5 "outflow coefficient of the upper tank";
  parameter Real alpha_lower(min=0) = 5 "outflow coefficient of the lower tank";
  final parameter Real area_upper(min=0) = 1 "cross-sections; 1 where they are not known";
  final parameter Real area_lower(min=0) = 1;
  constant Real w = 1e-4 "below this level a parabola stands for the root, whose slope has no bound at empty";
  input Real u "command to the pump";
  Real level_upper(quantity="Level", start=10);
  output Real level_lower(quantity="Level", start=10);
  Real outflow_upper = alpha_upper*(if level_upper >= w then sqrt(level_upper) elseif level_upper > 0 then (1.5 - 0.5*level_upper/w)*level_upper/sqrt(w) else 0);
  Real outflow_lower = alpha_lower*(if level_lower >= w then sqrt(level_lower) elseif level_lower > 0 then (1.5 - 0.5*level_lower/w)*level_lower/sqrt(w) else 0);
equation
  area_upper*der(level_upper) = pump_gain*u - outflow_upper;
  area_lower*der(level_lower) = outflow_upper - outflow_lower;
end CascadedTanks;
