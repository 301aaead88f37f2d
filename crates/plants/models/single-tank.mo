model SingleTank "a tank that a pump fills and that drains through a hole in its bottom"
  // Units are those of the record.
  parameter Real pump_gain(min=0) = 9 "inflow for one unit of the command";
  parameter Real alpha(min=0) = 13 "outflow coefficient";
  final parameter Real area(min=0) = 1 "cross-section; 1 where it is not known: flows are in units of the level then";
  constant Real w = 1e-4 "below this level a parabola stands for the root, whose slope has no bound at empty";
  input Real u "command to the pump";
  output Real level(quantity="Level", start=10);
  Real outflow = alpha*(if level >= w then sqrt(level) elseif level > 0 then (1.5 - 0.5*level/w)*level/sqrt(w) else 0);
equation
  area*der(level) = pump_gain*u - outflow;
end SingleTank;
